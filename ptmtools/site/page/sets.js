function T({eye:n,planes:t},e,s,i=0,o=i){for(let c=0;c<t.length;c+=3){let a=0;for(let r=0;r<3;r++){let h=t[c+r];a+=((h>0?s[o+r]:e[i+r])-n[r])*h}if(!(a>0))return!1}return!0}function X(n,t,e,s=0,i=s){let o=0;for(let c=0;c<3;c++){let a=Math.max(t[s+c]-n[c],n[c]-e[i+c],0);o+=a*a}return Math.sqrt(o)}var st=({catalogue:n,frustum:t},e)=>!!t&&T(t,n.low,n.high,3*e);function _({catalogue:{meshes:n},cell:t,known:e,downloads:s}){return[...n.keys()].filter(i=>n[i+1]?.mesh!==n[i].mesh&&e[t]?.visible.includes(n[i].cell)&&s.has("geometry",n[i].cell))}function $(n,t){let{cell:e,here:s,known:i,downloads:o}=n,c=o.has("record",s)||!t("record",s)?0:1;for(let a of i[e]?.visible??[])(a===e||st(n,a))&&!o.has("geometry",a)&&t("geometry",a)&&c++;for(let a of _(n))!o.has("mesh",a)&&t("mesh",a)&&c++;return c}var it=8,nt=.05,y=class{#t;#e;#r;#n;#s;#i;#a;#h=0;#o=[];#c=1;constructor(t,e,s,i){let{T:o}=t.catalogue;this.#t=t,this.#e=e,this.#r=s,this.#n=i,this.#s=new Float64Array(o),this.#i=new Int32Array(o),this.#a=new Int32Array(o).fill(-1),this.target=new Int32Array(o)}learned(){}look(){let{column:t,have:e}=this.#t;this.#f(),this.#u(),this.#l(this.#i,this.target),this.#d(this.#l(this.#i.map((s,i)=>Math.min(s,e[i])),t))}#f(){let{catalogue:{T:t,levels:e},downloads:s,frustum:i}=this.#t,o=this.#n(),c=new Float64Array(2*t);this.#s.fill(1/0),this.#h++;for(let[a,r]of this.#r)if(!(!i||!s.has("geometry",a)))for(let{texture:h,low:l,high:d,side:g}of r){if(!T(i,l,d))continue;let f=Math.max(X(i.eye,l,d),nt);this.#s[h]=Math.min(this.#s[h],f);for(let u of[0,1])c[2*h+u]=Math.max(c[2*h+u],g[u]/(f*o))}for(let a=0;a<t;a++){if(this.#i[a]=0,this.#s[a]===1/0)continue;let r=this.#e[a].parts.filter(({joined:{width:h,height:l}})=>h<c[2*a]||l<c[2*a+1]).length;this.#i[a]=Math.min(r+1,e[a]),this.#a[a]=this.#h}}#u(){let t=this.#s,e=s=>Math.floor(t[s]/it);this.#o=[],this.#i.forEach((s,i)=>{for(let o=1;o<=s;o++)this.#o.push([i,o])}),this.#o.sort(([s,i],[o,c])=>e(s)-e(o)||i-c||t[s]-t[o]||s-o)}#l(t,e){let{budget:s,catalogue:{K:i,memory:o}}=this.#t,c=s;e.fill(0);for(let[a,r]of this.#o){let h=o[a*i+r]-o[a*i+r-1];r>t[a]||e[a]!==r-1||h>c||(e[a]=r,c-=h)}return c}#d(t){let{catalogue:{K:e,memory:s},column:i,have:o}=this.#t,c=this.#a,a=[...c.keys()].filter(r=>c[r]>=0);a.sort((r,h)=>c[h]-c[r]||this.#s[r]-this.#s[h]||r-h);for(let r of a){let h=s[r*e+i[r]],l=i[r];for(;l<o[r]&&s[r*e+l+1]<=h+t;)l++;i[r]=l,t-=s[r*e+l]-h}}missing(t){let{have:e}=this.#t,s=this.target.reduce((i,o,c)=>i+ +(e[c]<o&&t("texture",c)),0);return $(this.#t,t)+s}next({concurrency:t}){let{catalogue:{K:e,ends:s},cell:i,here:o,known:c,downloads:a}=this.#t,r=[["record",o]];for(let h of c[i]?.visible??[])r.push(["geometry",h]);for(let h of _(this.#t))r.push(["mesh",h]);for(let[h,l]of r)if(a.free(h,l))return a.ask(h,l,-this.#c++);if(a.waiting.size>=t)return null;for(let[h,l]of this.#o){let d=s[h*e+l];if(!(l>this.target[h]||a.asked[h]>=d||!a.free("texture",h)))return a.ask("texture",h,-this.#c++,d)}return null}};var U=(n="",t="")=>`#version 300 es
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
void main(){shown=vec4(bytes(item),0.0,1.0);}`,C={surface:[U(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),ot],item:[U(),at],placeholder:[U(),ht]};function B(n,t,e=C[t]){let s=n.createProgram(),i=[n.VERTEX_SHADER,n.FRAGMENT_SHADER];if(e.forEach((a,r)=>{let h=n.createShader(i[r]);n.shaderSource(h,a),n.compileShader(h),n.attachShader(s,h),n.deleteShader(h)}),n.linkProgram(s),!n.getProgramParameter(s,n.LINK_STATUS)&&!n.isContextLost())throw new Error(`${t}: ${n.getProgramInfoLog(s)}`);let o={},c=n.isContextLost()?0:n.getProgramParameter(s,n.ACTIVE_UNIFORMS);for(let a=0;a<c;a++){let r=n.getActiveUniform(s,a)?.name??"";o[r]=n.getUniformLocation(s,r)}return{program:s,at:o}}var ct=Uint32Array.from({length:256},(n,t)=>{for(let e=0;e<8;e++)t=t&1?t>>>1^3988292384:t>>>1;return t});function I(n,t=0){let e=~t;for(let s=0;s<n.length;s++)e=ct[(e^n[s])&255]^e>>>8;return~e>>>0}var Ct=2**24;var Bt=new Uint8Array([3,0]);function m(n,t){if(!n)throw new Error(t)}var E=(n,t,e)=>Number.isInteger(n)&&t<=n&&n<=e;var G={png:"image/png",jpg:"image/jpeg",webp:"image/webp"},lt=65536,ft=2**30;function z(n){m(n?.format==="ptmtools interlaced image"&&n.schema===1,"not an index of an interlaced image");let{width:t,height:e,container:s,files:i,kind:o,original:c}=n,a=h=>E(h,1,lt);m(a(t)&&a(e)&&a(c?.width)&&a(c?.height),"no size"),m(s in G&&(o==="uint8"||o==="uint16"),"another container"),m(Array.isArray(i)&&E(i.length,1,33),"no files");let r={width:0,height:0};return i.forEach((h,l)=>{let{axis:d,joined:g}=h;m(h.name===`${l+1}.${s}`,"a file of another name"),m(a(h.width)&&a(h.height),"a file without size"),m(E(h.bytes,1,9*h.width*h.height+2**20),"a file of too many bytes"),m(E(h.crc32,0,4294967295)&&(l?d==="columns"||d==="rows":d===null),"no axis");let[f,u]=l?d==="columns"?[2,1]:[1,2]:[1,1];l||(r={width:h.width,height:h.height}),m(h.width===r.width&&h.height===r.height,"a file of another size"),r={width:f*r.width,height:u*r.height},m(g?.width===r.width&&g?.height===r.height,"a step of another size")}),m(r.width===t&&r.height===e,"steps that do not make the image"),n}var ut=`#version 300 es
void main(){
gl_Position=vec4(4*(gl_VertexID & 1)-1,4*(gl_VertexID >> 1)-1,0,1);
}`,dt=`#version 300 es
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
}`,mt={columns:[0,255,0,255],rows:[0,0,255,255],first:[255,255,255,255]};async function pt(n,t){if(!t)return createImageBitmap(n,{colorSpaceConversion:"none"});let e=URL.createObjectURL(n),s=Object.assign(new Image,{src:e});return await s.decode().finally(()=>URL.revokeObjectURL(e)),s}function V(n,{container:t},{bytes:e,crc32:s}){return m(n.length===e&&I(n)===s,"another checksum"),new Blob([n],{type:G[t]})}async function P(n,{components:t},{width:e,height:s}){let i=await pt(n,t%2===0);return m(i.width===e&&i.height===s,"an image of another size"),i}var v=class{constructor(t){this.gl=t,this.use=B(t,"join",[ut,dt]),this.buffer=t.createFramebuffer(),this.patterns=Object.fromEntries(Object.entries(mt).map(([e,s])=>{let i=this.#t(2,2,t.R8);for(let o of[t.TEXTURE_WRAP_S,t.TEXTURE_WRAP_T])t.texParameteri(t.TEXTURE_2D,o,t.REPEAT);return t.pixelStorei(t.UNPACK_ALIGNMENT,1),t.texSubImage2D(t.TEXTURE_2D,0,0,0,2,2,t.RED,t.UNSIGNED_BYTE,new Uint8Array(s)),[e,i]}))}upload(t){let{gl:e}=this,s=this.#t(t.width,t.height,e.RGBA8);return e.pixelStorei(e.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),e.pixelStorei(e.UNPACK_COLORSPACE_CONVERSION_WEBGL,e.NONE),e.texSubImage2D(e.TEXTURE_2D,0,0,0,e.RGBA,e.UNSIGNED_BYTE,t),"close"in t&&t.close(),s}join({axis:t,joined:{width:e,height:s}},i,o,c=4,a=!1){let{gl:r,use:{program:h,at:l}}=this,d=a?1+Math.floor(Math.log2(Math.max(e,s))):1,g=this.#t(e,s,c===1?r.R8:c===2?r.RG8:r.RGBA8,d);r.bindFramebuffer(r.FRAMEBUFFER,this.buffer),r.framebufferTexture2D(r.FRAMEBUFFER,r.COLOR_ATTACHMENT0,r.TEXTURE_2D,g,0),r.viewport(0,0,e,s),r.disable(r.BLEND),r.useProgram(h);let f={before:i??o,next:o,pattern:this.patterns[t??"first"]};return Object.entries(f).forEach(([u,p],x)=>{r.activeTexture(r.TEXTURE0+x),r.bindTexture(r.TEXTURE_2D,p),p===i&&this.#e(r.NEAREST,r.NEAREST),r.uniform1i(l[u],x)}),r.activeTexture(r.TEXTURE0),r.uniform2f(l.size,e,s),r.uniform1i(l.pairs,+(c===2)),r.drawArrays(r.TRIANGLES,0,3),r.bindFramebuffer(r.FRAMEBUFFER,null),r.deleteTexture(i),r.deleteTexture(o),a&&(r.bindTexture(r.TEXTURE_2D,g),r.generateMipmap(r.TEXTURE_2D),this.#e(r.LINEAR_MIPMAP_LINEAR,r.LINEAR)),g}texels(t,e,s){let{gl:i}=this,o=new Uint8Array(4*e*s);return i.bindFramebuffer(i.FRAMEBUFFER,this.buffer),i.framebufferTexture2D(i.FRAMEBUFFER,i.COLOR_ATTACHMENT0,i.TEXTURE_2D,t,0),i.readPixels(0,0,e,s,i.RGBA,i.UNSIGNED_BYTE,o),i.bindFramebuffer(i.FRAMEBUFFER,null),o}#t(t,e,s,i=1){let{gl:o}=this,c=o.createTexture();o.bindTexture(o.TEXTURE_2D,c),o.texStorage2D(o.TEXTURE_2D,i,s,t,e),this.#e(o.NEAREST,o.NEAREST);for(let a of[o.TEXTURE_WRAP_S,o.TEXTURE_WRAP_T])o.texParameteri(o.TEXTURE_2D,a,o.CLAMP_TO_EDGE);return c}#e(t,e){this.gl.texParameteri(this.gl.TEXTURE_2D,this.gl.TEXTURE_MIN_FILTER,t),this.gl.texParameteri(this.gl.TEXTURE_2D,this.gl.TEXTURE_MAG_FILTER,e)}};function W(n,{files:t}){let e=n.getParameter(n.MAX_TEXTURE_SIZE),s=t.findIndex(({joined:{width:i,height:o}})=>Math.max(i,o)>e||4*i*o>ft);return s<0?t.length:s}var gt=3,D=class{#t=-1;constructor(t,e){this.gl=t,this.set=e,this.channels=e.channels,this.steps=0,this.texture=null}get bytes(){return this.steps?this.set.memory[this.steps-1]:0}add(t,e){let s=t.upload(e);this.texture=t.join(this.set.parts[this.steps],this.texture,s,this.channels,!0),this.steps++,this.#t=-1}bind(t,e){let{gl:s}=this,i=+t+2*+e;if(s.bindTexture(s.TEXTURE_2D,this.texture),i!==this.#t){let[o,c]=[t,e].map(a=>a?s.CLAMP_TO_EDGE:s.REPEAT);s.texParameteri(s.TEXTURE_2D,s.TEXTURE_WRAP_S,o),s.texParameteri(s.TEXTURE_2D,s.TEXTURE_WRAP_T,c),this.#t=i}return!1}delete(){this.gl.deleteTexture(this.texture)}},O=class{image=null;constructor(t){this.joined=t}},R=class{#t;#e=new Map;#r=null;#n;#s;#i;constructor(t,e){this.gl=t,this.sets=e,this.#t=e.map(()=>null),this.held=new Int32Array(e.length),this.loss=new Float64Array(e.length),this.#n=new Int32Array(e.length),this.#i=new Int32Array(e.length),this.#s=new Float64Array(e.length),this.budget=1/0,this.peak=0,this.fades=!0}get bytes(){let t=[...this.#t,...[...this.#e.values()].map(e=>e.joined)];return[...new Set(t)].reduce((e,s)=>e+(s?.bytes??0),0)}of(t){return this.#t[t]}settle(t,e){this.#n.set(t),this.#s.set(e),this.#i.fill(0);for(let s=0;s<t.length;s++)t[s]===0&&this.#c(s);this.#a()}hold(){this.#n=this.held.map((t,e)=>Math.max(t,Math.min(this.#n[e],this.#i[e])))}resume(){this.#a()}#a(){let t=()=>[...this.#e.values()].filter(({image:s})=>!s).length,e=[...this.held.keys()].filter(s=>this.#n[s]>0&&this.held[s]!==this.#n[s]);e.sort((s,i)=>+(this.held[s]>0)-+(this.held[i]>0)||this.#s[i]-this.#s[s]);for(let s of e){if(t()>=gt)break;if(this.#e.has(s))continue;let i=this.#t[s],o=i&&i.steps<this.#n[s];this.#h(s,o?i:new D(this.gl,this.sets[s]))}}#h(t,e){let s=new O(e);this.#e.set(t,s),this.sets[t].image(e.steps).then(i=>{this.#e.get(t)===s?s.image=i:"close"in i&&i.close()},()=>this.#o(t))}#o(t){let e=this.#e.get(t);this.#e.delete(t),e?.image&&"close"in e.image&&e.image.close(),e&&e.joined!==this.#t[t]&&e.joined.delete()}#c(t){this.#o(t),this.#t[t]?.delete(),this.#t[t]=null,this.held[t]=0}pump(t,e){let s=!1;for(let[i,{image:o,joined:c}]of[...this.#e]){if(!o)continue;if(e()&&s)break;this.#r??=new v(this.gl),c.add(this.#r,o),s=!0,this.peak=Math.max(this.peak,this.bytes),this.#e.delete(i);let a=this.#t[i],r=this.#n[i];!a||c===a||c.steps>=r?(c!==a&&a?.delete(),this.#t[i]=c,this.held[i]=c.steps):a.steps>r?this.#h(i,c):c.delete()}return s&&this.#a(),s}texels(t){let e=this.#t[t];if(!e||!this.#r)return null;let{width:s,height:i}=e.set.parts[e.steps-1].joined;return{width:s,height:i,texels:this.#r.texels(e.texture,s,i)}}delete(){for(let t=0;t<this.sets.length;t++)this.#c(t)}lose(){this.#i=this.held.map((t,e)=>Math.max(t,this.#i[e])),this.#t.fill(null),this.#e.clear(),this.#r=null,this.held.fill(0)}};var M=class{low=[1/0,1/0,1/0];high=[-1/0,-1/0,-1/0];#t=0;#e=[0,0];add(t,e,s){for(let i of t)this.low=this.low.map((o,c)=>Math.min(o,i[c])),this.high=this.high.map((o,c)=>Math.max(o,i[c]));this.#t+=e,this.#e=this.#e.map((i,o)=>i+e*s[o])}piece(t){let e=this.#e.map(s=>s>0?this.#t/s:0);return{texture:t,low:this.low,high:this.high,side:e}}};function N({positions:n,indices:t},e,s){let i=new M,o=wt(t,n.length/3),c=new Map;for(let a=0;a<t.length;a+=3){let r=t.subarray(a,a+3),h=Array.from(r,w=>Array.from(n.subarray(3*w,3*w+3))),[l,d]=[1,2].map(w=>h[w].map((A,b)=>A-h[0][b])),g=[0,1,2].map(w=>l[(w+1)%3]*d[(w+2)%3]-l[(w+2)%3]*d[(w+1)%3]),f=Math.hypot(...g);if(!(f>0))continue;let[u,p]=[0,1].map(w=>{let[A,b]=[1,2].map(S=>s[2*r[S]+w]-s[2*r[0]+w]);return Math.hypot(...l.map((S,et)=>b*S-A*d[et]))/f});if(i.add(h,f,[u,p]),c.size>256)continue;let x=o(r[0]),L=c.get(x)??new M;c.set(x,L),L.add(h,f,[u,p])}return(c.size>256?[i]:[...c.values()]).map(a=>a.piece(e))}function wt(n,t){let e=Uint32Array.from({length:t},(i,o)=>o),s=i=>{for(;e[i]!==i;)i=e[i]=e[e[i]];return i};return n.forEach((i,o)=>{o%3&&(e[s(i)]=s(n[o-1]))}),s}function xt({width:n,height:t}){let e=n*t;for(;n>1||t>1;)[n,t]=[Math.max(1,n>>1),Math.max(1,t>>1)],e+=n*t;return e}var F=class{#t=[];#e=null;constructor(t,e,s,i){this.index=t,this.urls=e,this.channels=i,this.parts=t.files.slice(0,s);let o=0;this.ends=this.parts.map(({bytes:c})=>o+=c),this.memory=this.parts.map(({joined:c})=>i*xt(c))}step(t){return this.ends.filter(e=>e<=t).length}async take(t,e){let s=this.parts[t],i=V(e,this.index,s),o=await P(i,this.index,s);this.#r(),this.#e=o,this.#t[t]=i}async image(t){let e=this.#e;return e&&t===this.#t.length-1?(this.#e=null,e):P(this.#t[t],this.index,this.parts[t])}#r(){this.#e&&"close"in this.#e&&this.#e.close(),this.#e=null}};function H(n,t,e,s){return m(n?.format==="ptmtools interlaced images"&&n.schema===1,"not a document of interlaced images"),m(Array.isArray(n.sets)&&n.sets.length===t.length,"other textures"),t.map((i,o)=>{let{manifest:c,files:a}=n.sets[o]??{},r=z(c);m(r.components===i.components,"another texture"),m(Array.isArray(a)&&a.length===r.files.length,"files without names");let h=W(s,r);return m(h>0,"an image larger than this graphics card's textures"),new F(r,a.map(l=>e(String(l))),h,i.gpuTexelBytes)})}function K(n,{ends:t,parts:e}){let{width:s,height:i}=e[e.length-1].joined;return{...n,width:s,height:i,ends:t,differences:t.map(()=>0),previews:[],offsets:void 0}}function q(n,t){let e=n.querySelector(t);if(!e)throw new Error(`the page has no ${t}`);return e}function Y(n,t={},...e){let s=document.createElement(n);for(let[i,o]of Object.entries(t))i in s?Reflect.set(s,i,o):s.setAttribute(i,o);return s.append(...e),s}var Z="Tell the owner of this site: publishing it again should repair it.",Q="Use a current Chrome, Edge or Firefox, or Safari 16.4 or newer",se={"PTM-V101":`${Q}, with hardware acceleration on.`,"PTM-V102":`${Q}.`,"PTM-V103":Z,"PTM-V104":"Check your connection and reload the page.","PTM-V106":"Update the browser, or allow this page to use web workers and more memory.","PTM-V105":Z};var J=8e3;function tt(n,...t){let e=Y("p",{},...t);q(n,"#notices").append(e);let s=()=>{e.contains(n.activeElement)?setTimeout(s,J):e.remove()};setTimeout(s,J)}var Et="This site has no interlaced images, so you see its own textures. `ptm emit DB --format vrml,gltf,interlace` writes some for a database.",Tt="The policy and the comparison are those of other textures than interlaced images.";async function ce(n,t,e,s){let{index:i}=n;if(!i.sets)return tt(document,Et),null;let o=n.of(i.sets),c=r=>new URL(r,o).href,a=await s.whole(o,r=>H(JSON.parse(new TextDecoder().decode(r)),i.textures,c,t));return e.opening=null,n.index={...i,textures:i.textures.map((r,h)=>K(r,a[h]))},r=>yt(r,a)}function yt(n,t){let{catalogue:e,client:s,gl:i,rows:o,sharpness:c}=n,{K:a,T:r,memory:h}=e;for(let f=0;f<r;f++){for(let u=1;u<a;u++)h[f*a+u]=t[f].memory[u-1]??h[f*a+u-1];o[f].sizes=t[f].parts}e.whole=t.reduce((f,{memory:u})=>f+u[u.length-1],0),n.firstLevels=1,vt(n,t);let l=new Map,d=s.learnGeometry.bind(s);s.learnGeometry=(f,u)=>{l.set(f,u.flatMap(p=>[...p.uvs?N(p,p.texture,p.uvs):[],...p.spots?N(p,p.light,p.spots):[]])),d(f,u)};let g=()=>2*Math.tan(n.tall/2)/c.lines;s.policy=()=>new y(s,t,l,g),n.policy="gpuii",n.memory.delete(),n.memory=new R(i,t),n.renderer&&(n.renderer.memory=n.memory),n.choose=n.compare=()=>n.emit("notice",{message:Tt})}function vt({client:n,fetcher:t,stream:e},s){let{bytes:i}=n.downloads,o=e.url.bind(e),c=t.range.bind(t),a=(h,l=i[h])=>s[h].urls[s[h].step(l)];e.url=(h,l)=>h==="texture"?a(l):o(h,l);let r=new Map(s.flatMap(({urls:h},l)=>h.map(d=>[d,l])));t.range=async(h,l,d,g,...f)=>{let u=r.get(h);if(u===void 0)return c(h,l,d,g,...f);let p=await t.whole(h,async x=>(await s[u].take(s[u].step(l),x),x),...f);return{begin:l,body:p}},e.files=s.map(h=>({row:h,length:0,append(l,{length:d}){this.length=l+d}}))}export{ce as setsOf};
