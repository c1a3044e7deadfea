function T({eye:n,planes:t},e,s,i=0,o=i){for(let a=0;a<t.length;a+=3){let h=0;for(let r=0;r<3;r++){let c=t[a+r];h+=((c>0?s[o+r]:e[i+r])-n[r])*c}if(!(h>0))return!1}return!0}function X(n,t,e,s=0,i=s){let o=0;for(let a=0;a<3;a++){let h=Math.max(t[s+a]-n[a],n[a]-e[i+a],0);o+=h*h}return Math.sqrt(o)}var st=({catalogue:n,frustum:t},e)=>!!t&&T(t,n.low,n.high,3*e);function U({catalogue:{meshes:n},cell:t,known:e,downloads:s}){return[...n.keys()].filter(i=>n[i+1]?.mesh!==n[i].mesh&&e[t]?.visible.includes(n[i].cell)&&s.has("geometry",n[i].cell))}function $(n,t){let{cell:e,here:s,known:i,downloads:o}=n,a=o.has("record",s)||!t("record",s)?0:1;for(let h of i[e]?.visible??[])(h===e||st(n,h))&&!o.has("geometry",h)&&t("geometry",h)&&a++;for(let h of U(n))!o.has("mesh",h)&&t("mesh",h)&&a++;return a}var it=8,nt=.05,y=class{#t;#e;#n;#i;#a;#s;#r;#h;#c=0;#o=[];#l=1;constructor(t,e,s,i,o){let{T:a}=t.catalogue;this.#t=t,this.#e=e,this.#n=s,this.#i=i,this.#a=o,this.#s=new Float64Array(a),this.#r=new Int32Array(a),this.#h=new Int32Array(a).fill(-1),this.target=new Int32Array(a)}learned(){}look(){let{column:t,have:e}=this.#t;this.#u(),this.#m(),this.#f(this.#r,this.target),this.#d(this.#f(this.#r.map((s,i)=>Math.min(s,e[i])),t))}#u(){let{catalogue:{T:t,levels:e},downloads:s,frustum:i}=this.#t,o=this.#i(),a=new Float64Array(2*t);this.#s.fill(1/0),this.#c++;for(let[h,r]of this.#n)if(!(!i||!s.has("geometry",h)))for(let{texture:c,low:l,high:u,side:x}of r){if(!T(i,l,u))continue;let g=Math.max(X(i.eye,l,u),nt);this.#s[c]=Math.min(this.#s[c],g);for(let f of[0,1])a[2*c+f]=Math.max(a[2*c+f],x[f]/(g*o))}for(let h=0;h<t;h++){if(this.#r[h]=0,this.#s[h]===1/0)continue;let r=this.#e[h].parts.filter(({joined:{width:c,height:l}})=>c<a[2*h]||l<a[2*h+1]).length;this.#r[h]=Math.min(r+1,e[h]),this.#h[h]=this.#c}}#m(){let t=this.#s,e=this.#a,s=i=>Math.floor(t[i]/it);this.#o=[],this.#r.forEach((i,o)=>{for(let a=1;a<=i;a++)this.#o.push([o,a])}),this.#o.sort(([i,o],[a,h])=>+e[i]-+e[a]||s(i)-s(a)||o-h||t[i]-t[a]||i-a)}#f(t,e){let{budget:s,catalogue:{K:i,memory:o}}=this.#t,a=s;e.fill(0);for(let[h,r]of this.#o){let c=o[h*i+r]-o[h*i+r-1];r>t[h]||e[h]!==r-1||c>a||(e[h]=r,a-=c)}return a}#d(t){let{catalogue:{K:e,memory:s},column:i,have:o}=this.#t,a=this.#h,h=[...a.keys()].filter(r=>a[r]>=0);h.sort((r,c)=>a[c]-a[r]||this.#s[r]-this.#s[c]||r-c);for(let r of h){let c=s[r*e+i[r]],l=i[r];for(;l<o[r]&&s[r*e+l+1]<=c+t;)l++;i[r]=l,t-=s[r*e+l]-c}}missing(t){let{have:e}=this.#t,s=this.target.reduce((i,o,a)=>i+ +(e[a]<o&&t("texture",a)),0);return $(this.#t,t)+s}next({concurrency:t}){let{catalogue:{K:e,ends:s},cell:i,here:o,known:a,downloads:h}=this.#t,r=[["record",o]];for(let c of a[i]?.visible??[])r.push(["geometry",c]);for(let c of U(this.#t))r.push(["mesh",c]);for(let[c,l]of r)if(h.free(c,l))return h.ask(c,l,-this.#l++);if(h.waiting.size>=t)return null;for(let[c,l]of this.#o){let u=s[c*e+l];if(!(l>this.target[c]||h.asked[c]>=u||!h.free("texture",c)))return h.ask("texture",c,-this.#l++,u)}return null}};var I=(n="",t="")=>`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
layout(location=0)in vec3 position;
layout(location=1)in vec2 place;
layout(location=2)in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${n}
void main(){
${t}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,rt=`
uniform sampler2D map;
uniform int channels;
uniform vec4 color;
uniform vec3 mean;
uniform bool textured;
vec4 texel(){
vec4 sampled=texture(map,uv);
if(channels==1)sampled=vec4(sampled.rrr,1.0);
if(channels==2)sampled=sampled.rrrg;
return channels==0?vec4(mean,1.0):sampled;
}`,ot=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
out vec4 shown;
${rt}
void main(){
vec4 sampled=texel();
float light=1.0;
if(!textured){
sampled=vec4(1.0);
float glow=lit !=0.0?0.7:0.25;
vec3 normal=cross(dFdx(seen),dFdy(seen));
float size=length(normal);
light=glow+(1.0-glow)*(size > 0.0?abs(dot(normal,normalize(seen)))/size:1.0);
}
if(lit !=0.0)light*=1.055*pow(lit < 0.0?texture(lightmap,spot).r:lit,1.0/2.4)-0.055;
shown=vec4(sampled.rgb*color.rgb*painted*light,sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
if(cutoff > 0.0)shown.a=1.0;
}`,k=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,at=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${k}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,ht=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${k}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,C={surface:[I(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),ot],item:[I(),at],placeholder:[I(),ht]};function B(n,t,e=C[t]){let s=n.createProgram(),i=[n.VERTEX_SHADER,n.FRAGMENT_SHADER];if(e.forEach((h,r)=>{let c=n.createShader(i[r]);n.shaderSource(c,h),n.compileShader(c),n.attachShader(s,c),n.deleteShader(c)}),n.linkProgram(s),!n.getProgramParameter(s,n.LINK_STATUS)&&!n.isContextLost())throw new Error(`${t}: ${n.getProgramInfoLog(s)}`);let o={},a=n.isContextLost()?0:n.getProgramParameter(s,n.ACTIVE_UNIFORMS);for(let h=0;h<a;h++){let r=n.getActiveUniform(s,h)?.name??"";o[r]=n.getUniformLocation(s,r)}return{program:s,at:o}}var ct=Uint32Array.from({length:256},(n,t)=>{for(let e=0;e<8;e++)t=t&1?t>>>1^3988292384:t>>>1;return t});function P(n,t=0){let e=~t;for(let s=0;s<n.length;s++)e=ct[(e^n[s])&255]^e>>>8;return~e>>>0}var Ct=2**24;var Bt=new Uint8Array([3,0]);function d(n,t){if(!n)throw new Error(t)}var E=(n,t,e)=>Number.isInteger(n)&&t<=n&&n<=e;var G={png:"image/png",jpg:"image/jpeg",webp:"image/webp"},lt=65536,ft=2**30;function z(n){d(n?.format==="ptmtools interlaced image"&&n.schema===1,"not an index of an interlaced image");let{width:t,height:e,container:s,files:i,kind:o,original:a}=n,h=c=>E(c,1,lt);d(h(t)&&h(e)&&h(a?.width)&&h(a?.height),"no size"),d(s in G&&(o==="uint8"||o==="uint16"),"another container"),d(Array.isArray(i)&&E(i.length,1,33),"no files");let r={width:0,height:0};return i.forEach((c,l)=>{let{axis:u,joined:x}=c;d(c.name===`${l+1}.${s}`,"a file of another name"),d(h(c.width)&&h(c.height),"a file without size"),d(E(c.bytes,1,9*c.width*c.height+2**20),"a file of too many bytes"),d(E(c.crc32,0,4294967295)&&(l?u==="columns"||u==="rows":u===null),"no axis");let[g,f]=l?u==="columns"?[2,1]:[1,2]:[1,1];l||(r={width:c.width,height:c.height}),d(c.width===r.width&&c.height===r.height,"a file of another size"),r={width:g*r.width,height:f*r.height},d(x?.width===r.width&&x?.height===r.height,"a step of another size")}),d(r.width===t&&r.height===e,"steps that do not make the image"),n}var ut=`#version 300 es
void main(){
gl_Position=vec4(4*(gl_VertexID & 1)-1,4*(gl_VertexID >> 1)-1,0,1);
}`,mt=`#version 300 es
precision highp float;
precision highp sampler2D;
uniform sampler2D before,next,pattern;
uniform vec2 size;
uniform bool pairs;
out vec4 texel;
void main(){
vec2 place=gl_FragCoord.xy/size;
vec4 added=texture(next,place);
if(pairs)added=added.rarr;
texel=texture(pattern,place*size/2.0).r==0.0?texture(before,place):added;
}`,dt={columns:[0,255,0,255],rows:[0,0,255,255],first:[255,255,255,255]};async function pt(n,t){if(!t)return createImageBitmap(n,{colorSpaceConversion:"none"});let e=URL.createObjectURL(n),s=Object.assign(new Image,{src:e});return await s.decode().finally(()=>URL.revokeObjectURL(e)),s}function V(n,{container:t},{bytes:e,crc32:s}){return d(n.length===e&&P(n)===s,"another checksum"),new Blob([n],{type:G[t]})}async function D(n,{components:t},{width:e,height:s}){let i=await pt(n,t%2===0);return d(i.width===e&&i.height===s,"an image of another size"),i}var v=class{constructor(t){this.gl=t,this.use=B(t,"join",[ut,mt]),this.buffer=t.createFramebuffer(),this.patterns=Object.fromEntries(Object.entries(dt).map(([e,s])=>{let i=this.#t(2,2,t.R8);for(let o of[t.TEXTURE_WRAP_S,t.TEXTURE_WRAP_T])t.texParameteri(t.TEXTURE_2D,o,t.REPEAT);return t.pixelStorei(t.UNPACK_ALIGNMENT,1),t.texSubImage2D(t.TEXTURE_2D,0,0,0,2,2,t.RED,t.UNSIGNED_BYTE,new Uint8Array(s)),[e,i]}))}upload(t){let{gl:e}=this,s=this.#t(t.width,t.height,e.RGBA8);return e.pixelStorei(e.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),e.pixelStorei(e.UNPACK_COLORSPACE_CONVERSION_WEBGL,e.NONE),e.texSubImage2D(e.TEXTURE_2D,0,0,0,e.RGBA,e.UNSIGNED_BYTE,t),"close"in t&&t.close(),s}join({axis:t,joined:{width:e,height:s}},i,o,a=4,h=!1){let{gl:r,use:{program:c,at:l}}=this,u=h?1+Math.floor(Math.log2(Math.max(e,s))):1,x=this.#t(e,s,a===1?r.R8:a===2?r.RG8:r.RGBA8,u);r.bindFramebuffer(r.FRAMEBUFFER,this.buffer),r.framebufferTexture2D(r.FRAMEBUFFER,r.COLOR_ATTACHMENT0,r.TEXTURE_2D,x,0),r.viewport(0,0,e,s),r.disable(r.BLEND),r.useProgram(c);let g={before:i??o,next:o,pattern:this.patterns[t??"first"]};return Object.entries(g).forEach(([f,p],m)=>{r.activeTexture(r.TEXTURE0+m),r.bindTexture(r.TEXTURE_2D,p),p===i&&this.#e(r.NEAREST,r.NEAREST),r.uniform1i(l[f],m)}),r.activeTexture(r.TEXTURE0),r.uniform2f(l.size,e,s),r.uniform1i(l.pairs,+(a===2)),r.drawArrays(r.TRIANGLES,0,3),r.bindFramebuffer(r.FRAMEBUFFER,null),r.deleteTexture(i),r.deleteTexture(o),h&&(r.bindTexture(r.TEXTURE_2D,x),r.generateMipmap(r.TEXTURE_2D),this.#e(r.LINEAR_MIPMAP_LINEAR,r.LINEAR)),x}texels(t,e,s){let{gl:i}=this,o=new Uint8Array(4*e*s);return i.bindFramebuffer(i.FRAMEBUFFER,this.buffer),i.framebufferTexture2D(i.FRAMEBUFFER,i.COLOR_ATTACHMENT0,i.TEXTURE_2D,t,0),i.readPixels(0,0,e,s,i.RGBA,i.UNSIGNED_BYTE,o),i.bindFramebuffer(i.FRAMEBUFFER,null),o}#t(t,e,s,i=1){let{gl:o}=this,a=o.createTexture();o.bindTexture(o.TEXTURE_2D,a),o.texStorage2D(o.TEXTURE_2D,i,s,t,e),this.#e(o.NEAREST,o.NEAREST);for(let h of[o.TEXTURE_WRAP_S,o.TEXTURE_WRAP_T])o.texParameteri(o.TEXTURE_2D,h,o.CLAMP_TO_EDGE);return a}#e(t,e){this.gl.texParameteri(this.gl.TEXTURE_2D,this.gl.TEXTURE_MIN_FILTER,t),this.gl.texParameteri(this.gl.TEXTURE_2D,this.gl.TEXTURE_MAG_FILTER,e)}};function W(n,{files:t}){let e=n.getParameter(n.MAX_TEXTURE_SIZE),s=t.findIndex(({joined:{width:i,height:o}})=>Math.max(i,o)>e||4*i*o>ft);return s<0?t.length:s}var gt=3,O=class{#t=-1;constructor(t,e){this.gl=t,this.set=e,this.channels=e.channels,this.steps=0,this.texture=null}get bytes(){return this.steps?this.set.memory[this.steps-1]:0}add(t,e){let s=t.upload(e);this.texture=t.join(this.set.parts[this.steps],this.texture,s,this.channels,!0),this.steps++,this.#t=-1}bind(t,e){let{gl:s}=this,i=+t+2*+e;if(s.bindTexture(s.TEXTURE_2D,this.texture),i!==this.#t){let[o,a]=[t,e].map(h=>h?s.CLAMP_TO_EDGE:s.REPEAT);s.texParameteri(s.TEXTURE_2D,s.TEXTURE_WRAP_S,o),s.texParameteri(s.TEXTURE_2D,s.TEXTURE_WRAP_T,a),this.#t=i}return!1}delete(){this.gl.deleteTexture(this.texture)}},N=class{image=null;constructor(t){this.joined=t}},R=class{#t;#e=new Map;#n=null;#i;#a;#s;constructor(t,e){this.gl=t,this.sets=e,this.#t=e.map(()=>null),this.held=new Int32Array(e.length),this.loss=new Float64Array(e.length),this.#i=new Int32Array(e.length),this.#s=new Int32Array(e.length),this.#a=new Float64Array(e.length),this.budget=1/0,this.peak=0,this.fades=!0}get bytes(){let t=[...this.#t,...[...this.#e.values()].map(e=>e.joined)];return[...new Set(t)].reduce((e,s)=>e+(s?.bytes??0),0)}of(t){return this.#t[t]}settle(t,e){this.#i.set(t),this.#a.set(e),this.#s.fill(0);for(let s=0;s<t.length;s++)t[s]===0&&this.#o(s);this.#r()}hold(){this.#i=this.held.map((t,e)=>Math.max(t,Math.min(this.#i[e],this.#s[e])))}resume(){this.#r()}#r(){let t=()=>[...this.#e.values()].filter(({image:s})=>!s).length,e=[...this.held.keys()].filter(s=>this.#i[s]>0&&this.held[s]!==this.#i[s]);e.sort((s,i)=>+(this.held[s]>0)-+(this.held[i]>0)||this.#a[i]-this.#a[s]);for(let s of e){if(t()>=gt)break;if(this.#e.has(s))continue;let i=this.#t[s],o=i&&i.steps<this.#i[s];this.#h(s,o?i:new O(this.gl,this.sets[s]))}}#h(t,e){let s=new N(e);this.#e.set(t,s),this.sets[t].image(e.steps).then(i=>{this.#e.get(t)===s?s.image=i:"close"in i&&i.close()},()=>this.#c(t))}#c(t){let e=this.#e.get(t);this.#e.delete(t),e?.image&&"close"in e.image&&e.image.close(),e&&e.joined!==this.#t[t]&&e.joined.delete()}#o(t){this.#c(t),this.#t[t]?.delete(),this.#t[t]=null,this.held[t]=0}pump(t,e){let s=!1;for(let[i,{image:o,joined:a}]of[...this.#e]){if(!o)continue;if(e()&&s)break;this.#n??=new v(this.gl),a.add(this.#n,o),s=!0,this.peak=Math.max(this.peak,this.bytes),this.#e.delete(i);let h=this.#t[i],r=this.#i[i];!h||a===h||a.steps>=r?(a!==h&&h?.delete(),this.#t[i]=a,this.held[i]=a.steps):h.steps>r?this.#h(i,a):a.delete()}return s&&this.#r(),s}texels(t){let e=this.#t[t];if(!e||!this.#n)return null;let{width:s,height:i}=e.set.parts[e.steps-1].joined;return{width:s,height:i,texels:this.#n.texels(e.texture,s,i)}}delete(){for(let t=0;t<this.sets.length;t++)this.#o(t)}lose(){this.#s=this.held.map((t,e)=>Math.max(t,this.#s[e])),this.#t.fill(null),this.#e.clear(),this.#n=null,this.held.fill(0)}};var M=class{low=[1/0,1/0,1/0];high=[-1/0,-1/0,-1/0];#t=0;#e=[0,0];add(t,e,s){for(let i of t)this.low=this.low.map((o,a)=>Math.min(o,i[a])),this.high=this.high.map((o,a)=>Math.max(o,i[a]));this.#t+=e,this.#e=this.#e.map((i,o)=>i+e*s[o])}piece(t){let e=this.#e.map(s=>s>0?this.#t/s:0);return{texture:t,low:this.low,high:this.high,side:e}}};function A({positions:n,indices:t},e,s){let i=new M,o=xt(t,n.length/3),a=new Map;for(let h=0;h<t.length;h+=3){let r=t.subarray(h,h+3),c=Array.from(r,w=>Array.from(n.subarray(3*w,3*w+3))),[l,u]=[1,2].map(w=>c[w].map((b,S)=>b-c[0][S])),x=[0,1,2].map(w=>l[(w+1)%3]*u[(w+2)%3]-l[(w+2)%3]*u[(w+1)%3]),g=Math.hypot(...x);if(!(g>0))continue;let[f,p]=[0,1].map(w=>{let[b,S]=[1,2].map(_=>s[2*r[_]+w]-s[2*r[0]+w]);return Math.hypot(...l.map((_,et)=>S*_-b*u[et]))/g});if(i.add(c,g,[f,p]),a.size>256)continue;let m=o(r[0]),L=a.get(m)??new M;a.set(m,L),L.add(c,g,[f,p])}return(a.size>256?[i]:[...a.values()]).map(h=>h.piece(e))}function xt(n,t){let e=Uint32Array.from({length:t},(i,o)=>o),s=i=>{for(;e[i]!==i;)i=e[i]=e[e[i]];return i};return n.forEach((i,o)=>{o%3&&(e[s(i)]=s(n[o-1]))}),s}function wt({width:n,height:t}){let e=n*t;for(;n>1||t>1;)[n,t]=[Math.max(1,n>>1),Math.max(1,t>>1)],e+=n*t;return e}var F=class{#t=[];#e=null;constructor(t,e,s,i){this.index=t,this.urls=e,this.channels=i,this.parts=t.files.slice(0,s);let o=0;this.ends=this.parts.map(({bytes:a})=>o+=a),this.memory=this.parts.map(({joined:a})=>i*wt(a))}step(t){return this.ends.filter(e=>e<=t).length}async take(t,e){let s=this.parts[t],i=V(e,this.index,s),o=await D(i,this.index,s);this.#n(),this.#e=o,this.#t[t]=i}async image(t){let e=this.#e;return e&&t===this.#t.length-1?(this.#e=null,e):D(this.#t[t],this.index,this.parts[t])}#n(){this.#e&&"close"in this.#e&&this.#e.close(),this.#e=null}};function H(n,t,e,s){return d(n?.format==="ptmtools interlaced images"&&n.schema===1,"not a document of interlaced images"),d(Array.isArray(n.sets)&&n.sets.length===t.length,"other textures"),t.map((i,o)=>{let{manifest:a,files:h}=n.sets[o]??{},r=z(a);d(r.components===i.components,"another texture"),d(Array.isArray(h)&&h.length===r.files.length,"files without names");let c=W(s,r);return d(c>0,"an image larger than this graphics card's textures"),new F(r,h.map(l=>e(String(l))),c,i.gpuTexelBytes)})}function K(n,{ends:t,parts:e}){let{width:s,height:i}=e[e.length-1].joined;return{...n,width:s,height:i,ends:t,differences:t.map(()=>0),previews:[],offsets:void 0}}function q(n,t){let e=n.querySelector(t);if(!e)throw new Error(`the page has no ${t}`);return e}function Y(n,t={},...e){let s=document.createElement(n);for(let[i,o]of Object.entries(t))i in s?Reflect.set(s,i,o):s.setAttribute(i,o);return s.append(...e),s}var Z="Tell the owner of this site: publishing it again should repair it.",Q="Use a current Chrome, Edge or Firefox, or Safari 16.4 or newer",se={"PTM-V101":`${Q}, with hardware acceleration on.`,"PTM-V102":`${Q}.`,"PTM-V103":Z,"PTM-V104":"Check your connection and reload the page.","PTM-V106":"Update the browser, or allow this page to use web workers and more memory.","PTM-V105":Z};var J=8e3;function tt(n,...t){let e=Y("p",{},...t);q(n,"#notices").append(e);let s=()=>{e.contains(n.activeElement)?setTimeout(s,J):e.remove()};setTimeout(s,J)}var Et="This site has no interlaced images, so you see its own textures. `ptm emit DB --format vrml,gltf,interlace` writes some for a database.",Tt="The policy and the comparison are those of other textures than interlaced images.";async function ce(n,t,e,s){let{index:i}=n;if(!i.sets)return tt(document,Et),null;let o=n.of(i.sets),a=r=>new URL(r,o).href,h=await s.whole(o,r=>H(JSON.parse(new TextDecoder().decode(r)),i.textures,a,t));return e.opening=null,n.index={...i,textures:i.textures.map((r,c)=>K(r,h[c]))},r=>yt(r,h)}function yt(n,t){let{catalogue:e,client:s,gl:i,rows:o,sharpness:a}=n,{K:h,T:r,memory:c}=e,l=n.index.textures.map(f=>f.normals===!0);for(let f=0;f<r;f++){for(let p=1;p<h;p++)c[f*h+p]=t[f].memory[p-1]??c[f*h+p-1];o[f].sizes=t[f].parts}e.whole=t.reduce((f,{memory:p})=>f+p[p.length-1],0),n.firstLevels=1,vt(n,t);let u=new Map,x=s.learnGeometry.bind(s);s.learnGeometry=(f,p)=>{u.set(f,p.flatMap(m=>[...m.uvs?A(m,m.texture,m.uvs):[],...m.spots?A(m,m.light,m.spots):[],...m.frames&&l[m.relief]?A(m,m.relief,m.frames[0]):[]])),x(f,p)};let g=()=>2*Math.tan(n.tall/2)/a.lines;s.policy=()=>new y(s,t,u,g,l),n.policy="gpuii",n.memory.delete(),n.memory=new R(i,t),n.renderer&&(n.renderer.memory=n.memory),n.choose=n.compare=()=>n.emit("notice",{message:Tt})}function vt({client:n,fetcher:t,stream:e},s){let{bytes:i}=n.downloads,o=e.url.bind(e),a=t.range.bind(t),h=(c,l=i[c])=>s[c].urls[s[c].step(l)];e.url=(c,l)=>c==="texture"?h(l):o(c,l);let r=new Map(s.flatMap(({urls:c},l)=>c.map(u=>[u,l])));t.range=async(c,l,u,x,...g)=>{let f=r.get(c);if(f===void 0)return a(c,l,u,x,...g);let p=await t.whole(c,async m=>(await s[f].take(s[f].step(l),m),m),...g);return{begin:l,body:p}},e.files=s.map(c=>({row:c,length:0,append(l,{length:u}){this.length=l+u}}))}export{ce as setsOf};
