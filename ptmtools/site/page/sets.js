function E({eye:r,planes:e},t,s,o=0,n=o){for(let a=0;a<e.length;a+=3){let h=0;for(let i=0;i<3;i++){let l=e[a+i];h+=((l>0?s[n+i]:t[o+i])-r[i])*l}if(!(h>0))return!1}return!0}function j(r,e,t,s=0,o=s){let n=0;for(let a=0;a<3;a++){let h=Math.max(e[s+a]-r[a],r[a]-t[o+a],0);n+=h*h}return Math.sqrt(n)}var se=({catalogue:r,frustum:e},t)=>!!e&&E(e,r.low,r.high,3*t);function P({catalogue:{meshes:r},cell:e,known:t,downloads:s}){return[...r.keys()].filter(o=>r[o+1]?.mesh!==r[o].mesh&&t[e]?.visible.includes(r[o].cell)&&s.has("geometry",r[o].cell))}function C(r,e){let{cell:t,here:s,known:o,downloads:n}=r,a=n.has("record",s)||!e("record",s)?0:1;for(let h of o[t]?.visible??[])(h===t||se(r,h))&&!n.has("geometry",h)&&e("geometry",h)&&a++;for(let h of P(r))!n.has("mesh",h)&&e("mesh",h)&&a++;return a}var oe=8,re=.05,v=class{#e;#t;#r;#o;#a;#s;#i;#h;#l=0;#n=[];#c=1;constructor(e,t,s,o,n){let{T:a}=e.catalogue;this.#e=e,this.#t=t,this.#r=s,this.#o=o,this.#a=n,this.#s=new Float64Array(a),this.#i=new Int32Array(a),this.#h=new Int32Array(a).fill(-1),this.target=new Int32Array(a)}learned(){}look(){let{column:e,have:t}=this.#e;this.#u(),this.#d(),this.#f(this.#i,this.target),this.#m(this.#f(this.#i.map((s,o)=>Math.min(s,t[o])),e))}#u(){let{catalogue:{T:e,levels:t},downloads:s,frustum:o}=this.#e,n=this.#o(),a=new Float64Array(2*e);this.#s.fill(1/0),this.#l++;for(let[h,i]of this.#r)if(!(!o||!s.has("geometry",h)))for(let{texture:l,low:c,high:u,side:w}of i){if(!E(o,c,u))continue;let g=Math.max(j(o.eye,c,u),re);this.#s[l]=Math.min(this.#s[l],g);for(let f of[0,1])a[2*l+f]=Math.max(a[2*l+f],w[f]/(g*n))}for(let h=0;h<e;h++){if(this.#i[h]=0,this.#s[h]===1/0)continue;let i=this.#t[h].parts.filter(({joined:{width:l,height:c}})=>l<a[2*h]||c<a[2*h+1]).length;this.#i[h]=Math.min(i+1,t[h]),this.#h[h]=this.#l}}#d(){let e=this.#s,t=this.#a,s=o=>Math.floor(e[o]/oe);this.#n=[],this.#i.forEach((o,n)=>{for(let a=1;a<=o;a++)this.#n.push([n,a])}),this.#n.sort(([o,n],[a,h])=>+t[o]-+t[a]||s(o)-s(a)||n-h||e[o]-e[a]||o-a)}#f(e,t){let{budget:s,catalogue:{K:o,memory:n}}=this.#e,a=s;t.fill(0);for(let[h,i]of this.#n){let l=n[h*o+i]-n[h*o+i-1];i>e[h]||t[h]!==i-1||l>a||(t[h]=i,a-=l)}return a}#m(e){let{catalogue:{K:t,memory:s},column:o,have:n}=this.#e,a=this.#h,h=[...a.keys()].filter(i=>a[i]>=0);h.sort((i,l)=>a[l]-a[i]||this.#s[i]-this.#s[l]||i-l);for(let i of h){let l=s[i*t+o[i]],c=o[i];for(;c<n[i]&&s[i*t+c+1]<=l+e;)c++;o[i]=c,e-=s[i*t+c]-l}}missing(e){let{have:t}=this.#e,s=this.target.reduce((o,n,a)=>o+ +(t[a]<n&&e("texture",a)),0);return C(this.#e,e)+s}next({concurrency:e}){let{catalogue:{K:t,ends:s},cell:o,here:n,known:a,downloads:h}=this.#e,i=[["record",n]];for(let l of a[o]?.visible??[])i.push(["geometry",l]);for(let l of P(this.#e))i.push(["mesh",l]);for(let[l,c]of i)if(h.free(l,c))return h.ask(l,c,-this.#c++);if(h.waiting.size>=e)return null;for(let[l,c]of this.#n){let u=s[l*t+c];if(!(c>this.target[l]||h.asked[l]>=u||!h.free("texture",l)))return h.ask("texture",l,-this.#c++,u)}return null}};var k=(r="",e="")=>`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
layout(location=0)in vec3 position;
layout(location=1)in vec2 place;
layout(location=2)in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${r}
void main(){
${e}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,ie=`
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
}`,ne=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
out vec4 shown;
${ie}
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
}`,X=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,ae=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${X}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,he=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${X}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,B={surface:[k(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),ne],item:[k(),ae],placeholder:[k(),he]};function z(r,e,t=B[e]){let s=r.createProgram(),o=[r.VERTEX_SHADER,r.FRAGMENT_SHADER];if(t.forEach((h,i)=>{let l=r.createShader(o[i]);r.shaderSource(l,h),r.compileShader(l),r.attachShader(s,l),r.deleteShader(l)}),r.linkProgram(s),!r.getProgramParameter(s,r.LINK_STATUS)&&!r.isContextLost())throw new Error(`${e}: ${r.getProgramInfoLog(s)}`);let n={},a=r.isContextLost()?0:r.getProgramParameter(s,r.ACTIVE_UNIFORMS);for(let h=0;h<a;h++){let i=r.getActiveUniform(s,h)?.name??"";n[i]=r.getUniformLocation(s,i)}return{program:s,at:n}}var le=Uint32Array.from({length:256},(r,e)=>{for(let t=0;t<8;t++)e=e&1?e>>>1^3988292384:e>>>1;return e});function I(r,e=0){let t=~e;for(let s=0;s<r.length;s++)t=le[(t^r[s])&255]^t>>>8;return~t>>>0}var ce=(r,e)=>Object.assign(e,Reflect.get(globalThis,"ptmWords")?.[r]);var T=ce("objects",{relief:"The relief of {name} does not fit the index.",object:"an object",octree:"The index has a wrong octree: {reason}",largeTexture:"This graphics card has no textures of 4,096 texels.",largeImage:"The image is larger than this graphics card's textures.",damaged:"{file} is damaged: {reason}",noSets:"This site has no interlaced images, so you see its own textures.",fixed:"The policy and the comparison are those of other textures than interlaced images."});var fe=Promise.resolve();var Ke=2**24;var qe=new Uint8Array([3,0]);function m(r,e){if(!r)throw new Error(e)}var y=(r,e,t)=>Number.isInteger(r)&&e<=r&&r<=t;var W={png:"image/png",jpg:"image/jpeg",webp:"image/webp"},de=65536,me=2**30;function V(r){m(r?.format==="ptmtools interlaced image"&&r.schema===1,"not an index of an interlaced image");let{width:e,height:t,container:s,files:o,kind:n,original:a}=r,h=l=>y(l,1,de);m(h(e)&&h(t)&&h(a?.width)&&h(a?.height),"no size"),m(s in W&&(n==="uint8"||n==="uint16"),"another container"),m(Array.isArray(o)&&y(o.length,1,33),"no files");let i={width:0,height:0};return o.forEach((l,c)=>{let{axis:u,joined:w}=l;m(l.name===`${c+1}.${s}`,"a file of another name"),m(h(l.width)&&h(l.height),"a file without size"),m(y(l.bytes,1,9*l.width*l.height+2**20),"a file of too many bytes"),m(y(l.crc32,0,4294967295)&&(c?u==="columns"||u==="rows":u===null),"no axis");let[g,f]=c?u==="columns"?[2,1]:[1,2]:[1,1];c||(i={width:l.width,height:l.height}),m(l.width===i.width&&l.height===i.height,"a file of another size"),i={width:g*i.width,height:f*i.height},m(w?.width===i.width&&w?.height===i.height,"a step of another size")}),m(i.width===e&&i.height===t,"steps that do not make the image"),r}var pe=`#version 300 es
void main(){
gl_Position=vec4(4*(gl_VertexID & 1)-1,4*(gl_VertexID >> 1)-1,0,1);
}`,ge=`#version 300 es
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
}`,we={columns:[0,255,0,255],rows:[0,0,255,255],first:[255,255,255,255]};async function xe(r,e){if(!e)return createImageBitmap(r,{colorSpaceConversion:"none"});let t=URL.createObjectURL(r),s=Object.assign(new Image,{src:t});return await s.decode().finally(()=>URL.revokeObjectURL(t)),s}function H(r,{container:e},{bytes:t,crc32:s}){return m(r.length===t&&I(r)===s,"another checksum"),new Blob([r],{type:W[e]})}async function D(r,{components:e},{width:t,height:s}){let o=await xe(r,e%2===0);return m(o.width===t&&o.height===s,"an image of another size"),o}var b=class{constructor(e){this.gl=e,this.use=z(e,"join",[pe,ge]),this.buffer=e.createFramebuffer(),this.patterns=Object.fromEntries(Object.entries(we).map(([t,s])=>{let o=this.#e(2,2,e.R8);for(let n of[e.TEXTURE_WRAP_S,e.TEXTURE_WRAP_T])e.texParameteri(e.TEXTURE_2D,n,e.REPEAT);return e.pixelStorei(e.UNPACK_ALIGNMENT,1),e.texSubImage2D(e.TEXTURE_2D,0,0,0,2,2,e.RED,e.UNSIGNED_BYTE,new Uint8Array(s)),[t,o]}))}upload(e){let{gl:t}=this,s=this.#e(e.width,e.height,t.RGBA8);return t.pixelStorei(t.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),t.pixelStorei(t.UNPACK_COLORSPACE_CONVERSION_WEBGL,t.NONE),t.texSubImage2D(t.TEXTURE_2D,0,0,0,t.RGBA,t.UNSIGNED_BYTE,e),"close"in e&&e.close(),s}join({axis:e,joined:{width:t,height:s}},o,n,a=4,h=!1){let{gl:i,use:{program:l,at:c}}=this,u=h?1+Math.floor(Math.log2(Math.max(t,s))):1,w=this.#e(t,s,a===1?i.R8:a===2?i.RG8:i.RGBA8,u);i.bindFramebuffer(i.FRAMEBUFFER,this.buffer),i.framebufferTexture2D(i.FRAMEBUFFER,i.COLOR_ATTACHMENT0,i.TEXTURE_2D,w,0),i.viewport(0,0,t,s),i.disable(i.BLEND),i.useProgram(l);let g={before:o??n,next:n,pattern:this.patterns[e??"first"]};return Object.entries(g).forEach(([f,p],d)=>{i.activeTexture(i.TEXTURE0+d),i.bindTexture(i.TEXTURE_2D,p),p===o&&this.#t(i.NEAREST,i.NEAREST),i.uniform1i(c[f],d)}),i.activeTexture(i.TEXTURE0),i.uniform2f(c.size,t,s),i.uniform1i(c.pairs,+(a===2)),i.drawArrays(i.TRIANGLES,0,3),i.bindFramebuffer(i.FRAMEBUFFER,null),i.deleteTexture(o),i.deleteTexture(n),h&&(i.bindTexture(i.TEXTURE_2D,w),i.generateMipmap(i.TEXTURE_2D),this.#t(i.LINEAR_MIPMAP_LINEAR,i.LINEAR)),w}texels(e,t,s){let{gl:o}=this,n=new Uint8Array(4*t*s);return o.bindFramebuffer(o.FRAMEBUFFER,this.buffer),o.framebufferTexture2D(o.FRAMEBUFFER,o.COLOR_ATTACHMENT0,o.TEXTURE_2D,e,0),o.readPixels(0,0,t,s,o.RGBA,o.UNSIGNED_BYTE,n),o.bindFramebuffer(o.FRAMEBUFFER,null),n}#e(e,t,s,o=1){let{gl:n}=this,a=n.createTexture();n.bindTexture(n.TEXTURE_2D,a),n.texStorage2D(n.TEXTURE_2D,o,s,e,t),this.#t(n.NEAREST,n.NEAREST);for(let h of[n.TEXTURE_WRAP_S,n.TEXTURE_WRAP_T])n.texParameteri(n.TEXTURE_2D,h,n.CLAMP_TO_EDGE);return a}#t(e,t){this.gl.texParameteri(this.gl.TEXTURE_2D,this.gl.TEXTURE_MIN_FILTER,e),this.gl.texParameteri(this.gl.TEXTURE_2D,this.gl.TEXTURE_MAG_FILTER,t)}};function K(r,{files:e}){let t=r.getParameter(r.MAX_TEXTURE_SIZE),s=e.findIndex(({joined:{width:o,height:n}})=>Math.max(o,n)>t||4*o*n>me);return s<0?e.length:s}var Te=3,O=class{#e=-1;constructor(e,t){this.gl=e,this.set=t,this.channels=t.channels,this.steps=0,this.texture=null}get bytes(){return this.steps?this.set.memory[this.steps-1]:0}add(e,t){let s=e.upload(t);this.texture=e.join(this.set.parts[this.steps],this.texture,s,this.channels,!0),this.steps++,this.#e=-1}bind(e,t){let{gl:s}=this,o=+e+2*+t;if(s.bindTexture(s.TEXTURE_2D,this.texture),o!==this.#e){let[n,a]=[e,t].map(h=>h?s.CLAMP_TO_EDGE:s.REPEAT);s.texParameteri(s.TEXTURE_2D,s.TEXTURE_WRAP_S,n),s.texParameteri(s.TEXTURE_2D,s.TEXTURE_WRAP_T,a),this.#e=o}return!1}delete(){this.gl.deleteTexture(this.texture)}},F=class{image=null;constructor(e){this.joined=e}},R=class{#e;#t=new Map;#r=null;#o;#a;#s;constructor(e,t){this.gl=e,this.sets=t,this.#e=t.map(()=>null),this.held=new Int32Array(t.length),this.loss=new Float64Array(t.length),this.#o=new Int32Array(t.length),this.#s=new Int32Array(t.length),this.#a=new Float64Array(t.length),this.budget=1/0,this.peak=0,this.fades=!0}get bytes(){let e=[...this.#e,...[...this.#t.values()].map(t=>t.joined)];return[...new Set(e)].reduce((t,s)=>t+(s?.bytes??0),0)}of(e){return this.#e[e]}settle(e,t){this.#o.set(e),this.#a.set(t),this.#s.fill(0);for(let s=0;s<e.length;s++)e[s]===0&&this.#n(s);this.#i()}hold(){this.#o=this.held.map((e,t)=>Math.max(e,Math.min(this.#o[t],this.#s[t])))}resume(){this.#i()}#i(){let e=()=>[...this.#t.values()].filter(({image:s})=>!s).length,t=[...this.held.keys()].filter(s=>this.#o[s]>0&&this.held[s]!==this.#o[s]);t.sort((s,o)=>+(this.held[s]>0)-+(this.held[o]>0)||this.#a[o]-this.#a[s]);for(let s of t){if(e()>=Te)break;if(this.#t.has(s))continue;let o=this.#e[s],n=o&&o.steps<this.#o[s];this.#h(s,n?o:new O(this.gl,this.sets[s]))}}#h(e,t){let s=new F(t);this.#t.set(e,s),this.sets[e].image(t.steps).then(o=>{this.#t.get(e)===s?s.image=o:"close"in o&&o.close()},()=>this.#l(e))}#l(e){let t=this.#t.get(e);this.#t.delete(e),t?.image&&"close"in t.image&&t.image.close(),t&&t.joined!==this.#e[e]&&t.joined.delete()}#n(e){this.#l(e),this.#e[e]?.delete(),this.#e[e]=null,this.held[e]=0}pump(e,t){let s=!1;for(let[o,{image:n,joined:a}]of[...this.#t]){if(!n)continue;if(t()&&s)break;this.#r??=new b(this.gl),a.add(this.#r,n),s=!0,this.peak=Math.max(this.peak,this.bytes),this.#t.delete(o);let h=this.#e[o],i=this.#o[o];!h||a===h||a.steps>=i?(a!==h&&h?.delete(),this.#e[o]=a,this.held[o]=a.steps):h.steps>i?this.#h(o,a):a.delete()}return s&&this.#i(),s}texels(e){let t=this.#e[e];if(!t||!this.#r)return null;let{width:s,height:o}=t.set.parts[t.steps-1].joined;return{width:s,height:o,texels:this.#r.texels(t.texture,s,o)}}delete(){for(let e=0;e<this.sets.length;e++)this.#n(e)}lose(){this.#s=this.held.map((e,t)=>Math.max(e,this.#s[t])),this.#e.fill(null),this.#t.clear(),this.#r=null,this.held.fill(0)}};var A=class{low=[1/0,1/0,1/0];high=[-1/0,-1/0,-1/0];#e=0;#t=[0,0];add(e,t,s){for(let o of e)this.low=this.low.map((n,a)=>Math.min(n,o[a])),this.high=this.high.map((n,a)=>Math.max(n,o[a]));this.#e+=t,this.#t=this.#t.map((o,n)=>o+t*s[n])}piece(e){let t=this.#t.map(s=>s>0?this.#e/s:0);return{texture:e,low:this.low,high:this.high,side:t}}};function M({positions:r,indices:e},t,s){let o=new A,n=ye(e,r.length/3),a=new Map;for(let h=0;h<e.length;h+=3){let i=e.subarray(h,h+3),l=Array.from(i,x=>Array.from(r.subarray(3*x,3*x+3))),[c,u]=[1,2].map(x=>l[x].map((S,U)=>S-l[0][U])),w=[0,1,2].map(x=>c[(x+1)%3]*u[(x+2)%3]-c[(x+2)%3]*u[(x+1)%3]),g=Math.hypot(...w);if(!(g>0))continue;let[f,p]=[0,1].map(x=>{let[S,U]=[1,2].map(_=>s[2*i[_]+x]-s[2*i[0]+x]);return Math.hypot(...c.map((_,te)=>U*_-S*u[te]))/g});if(o.add(l,g,[f,p]),a.size>256)continue;let d=n(i[0]),L=a.get(d)??new A;a.set(d,L),L.add(l,g,[f,p])}return(a.size>256?[o]:[...a.values()]).map(h=>h.piece(t))}function ye(r,e){let t=Uint32Array.from({length:e},(o,n)=>n),s=o=>{for(;t[o]!==o;)o=t[o]=t[t[o]];return o};return r.forEach((o,n)=>{n%3&&(t[s(o)]=s(r[n-1]))}),s}function Ee({width:r,height:e}){let t=r*e;for(;r>1||e>1;)[r,e]=[Math.max(1,r>>1),Math.max(1,e>>1)],t+=r*e;return t}var N=class{#e=[];#t=null;constructor(e,t,s,o){this.index=e,this.urls=t,this.channels=o,this.parts=e.files.slice(0,s);let n=0;this.ends=this.parts.map(({bytes:a})=>n+=a),this.memory=this.parts.map(({joined:a})=>o*Ee(a))}step(e){return this.ends.filter(t=>t<=e).length}async take(e,t){let s=this.parts[e],o=H(t,this.index,s),n=await D(o,this.index,s);this.#r(),this.#t=n,this.#e[e]=o}async image(e){let t=this.#t;return t&&e===this.#e.length-1?(this.#t=null,t):D(this.#e[e],this.index,this.parts[e])}#r(){this.#t&&"close"in this.#t&&this.#t.close(),this.#t=null}};function q(r,e,t,s){return m(r?.format==="ptmtools interlaced images"&&r.schema===1,"not a document of interlaced images"),m(Array.isArray(r.sets)&&r.sets.length===e.length,"other textures"),e.map((o,n)=>{let{manifest:a,files:h}=r.sets[n]??{},i=V(a);m(i.components===o.components,"another texture"),m(Array.isArray(h)&&h.length===i.files.length,"files without names");let l=K(s,i);return m(l>0,"an image larger than this graphics card's textures"),new N(i,h.map(c=>t(String(c))),l,o.gpuTexelBytes)})}function Y(r,{ends:e,parts:t}){let{width:s,height:o}=t[t.length-1].joined;return{...r,width:s,height:o,ends:e,differences:e.map(()=>0),previews:[],offsets:void 0}}function Z(r,e){let t=r.querySelector(e);if(!t)throw new Error(`the page has no ${e}`);return t}function Q(r,e={},...t){let s=document.createElement(r);for(let[o,n]of Object.entries(e))o in s?Reflect.set(s,o,n):s.setAttribute(o,n);return s.append(...t),s}var J=8e3;function ee(r,...e){let t=Q("p",{},...e);Z(r,"#notices").append(t);let s=()=>{t.contains(r.activeElement)?setTimeout(s,J):t.remove()};setTimeout(s,J)}async function Tt(r,e,t,s){let{index:o}=r;if(!o.sets)return ee(document,T.noSets),null;let n=r.of(o.sets),a=i=>new URL(i,n).href,h=await s.whole(n,i=>q(JSON.parse(new TextDecoder().decode(i)),o.textures,a,e));return t.opening=null,r.index={...o,textures:o.textures.map((i,l)=>Y(i,h[l]))},i=>ve(i,h)}function ve(r,e){let{catalogue:t,client:s,gl:o,rows:n,sharpness:a}=r,{K:h,T:i,memory:l}=t,c=r.index.textures.map(f=>f.normals===!0);for(let f=0;f<i;f++){for(let p=1;p<h;p++)l[f*h+p]=e[f].memory[p-1]??l[f*h+p-1];n[f].sizes=e[f].parts}t.whole=e.reduce((f,{memory:p})=>f+p[p.length-1],0),r.firstLevels=1,be(r,e);let u=new Map,w=s.learnGeometry.bind(s);s.learnGeometry=(f,p)=>{u.set(f,p.flatMap(d=>[...d.uvs?M(d,d.texture,d.uvs):[],...d.spots?M(d,d.light,d.spots):[],...d.frames&&c[d.relief]?M(d,d.relief,d.frames[0]):[]])),w(f,p)};let g=()=>2*Math.tan(r.tall/2)/a.lines;s.policy=()=>new v(s,e,u,g,c),r.policy="gpuii",r.memory.delete(),r.memory=new R(o,e),r.renderer&&(r.renderer.memory=r.memory),r.choose=r.compare=()=>r.emit("notice",{message:T.fixed})}function be({client:r,fetcher:e,stream:t},s){let{bytes:o}=r.downloads,n=t.url.bind(t),a=e.range.bind(e),h=(l,c=o[l])=>s[l].urls[s[l].step(c)];t.url=(l,c)=>l==="texture"?h(c):n(l,c);let i=new Map(s.flatMap(({urls:l},c)=>l.map(u=>[u,c])));e.range=async(l,c,u,w,...g)=>{let f=i.get(l);if(f===void 0)return a(l,c,u,w,...g);let p=await e.whole(l,async d=>(await s[f].take(s[f].step(c),d),d),...g);return{begin:c,body:p}},t.files=s.map(l=>({row:l,length:0,append(c,{length:u}){this.length=c+u}}))}export{Tt as setsOf};
